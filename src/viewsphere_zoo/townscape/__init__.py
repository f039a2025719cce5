"""The parts of streets, houses, trees and street furniture."""
