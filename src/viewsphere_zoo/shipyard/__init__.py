"""The parts of a boat: lines, shell, deck, fittings, engines, spars and sails."""
