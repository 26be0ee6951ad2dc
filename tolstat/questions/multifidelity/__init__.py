"""The same answer from many cheap and few dear joints."""
