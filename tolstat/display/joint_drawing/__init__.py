"""Drawings of a Cardan joint from plain numbers: views of the joint, kinds of errors, errors of one joint enlarged."""
