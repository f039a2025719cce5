"""What people of the zoo are made of: a skeleton, fields that are flesh and clothes, weights, and what they do."""
