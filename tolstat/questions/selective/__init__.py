"""What sorting pins and holes in classes gains, and how many parts remain without a partner."""
