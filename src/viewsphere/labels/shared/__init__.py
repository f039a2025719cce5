"""The code that several labels share: specs, contexts, records, proofs."""
