"""What a row is: tables, columns, status; units, files, errors, strict input models."""
