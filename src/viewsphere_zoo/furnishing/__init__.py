"""The common parts of furniture: boards, handles, cushions, bedding, woods and cloths that the families share."""
