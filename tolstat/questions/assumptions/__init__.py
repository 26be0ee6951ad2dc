"""What a verdict stands on: values of the joint that nobody measured."""
