"""What streets, houses, trees and street furniture are built from."""
