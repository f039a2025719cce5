"""What rooms are furnished with: boards, handles, cushions, bedding, woods and cloths that the families share."""
