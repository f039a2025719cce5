"""From a row to a shot: who stands where, moves how and is seen from where, in which light."""
