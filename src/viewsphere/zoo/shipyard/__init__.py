"""What a boat is built from: lines, shell, deck, fittings, engines, spars and sails."""
