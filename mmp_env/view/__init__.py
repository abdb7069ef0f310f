"""Views for people: pictures, films, conflict-tree drawings, notebook views and rerun recordings."""
