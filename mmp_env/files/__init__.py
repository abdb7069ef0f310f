"""Reading and writing cells, instances, plans and episodes: one module for each schema."""
