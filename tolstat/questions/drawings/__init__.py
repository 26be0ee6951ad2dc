"""What a joint looks like: its parts, the meaning of its errors, the errors of one joint."""
