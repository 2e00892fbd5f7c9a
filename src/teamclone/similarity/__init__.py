"""Which teams play alike, by how well the clone of each predicts what the others do."""
