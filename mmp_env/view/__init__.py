"""What people look at: pictures, films, conflict-tree drawings, notebook views and rerun recordings."""
