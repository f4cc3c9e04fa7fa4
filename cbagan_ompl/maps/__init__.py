"""Maps: files, coordinates, exact checks, searches and connectivity on the grid."""
