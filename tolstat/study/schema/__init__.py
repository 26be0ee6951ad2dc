"""JSON schemas of study, joint and case files, made from the input models and the registries of errors and loads."""

from tolstat.study.schema.files import KINDS, schema

__all__ = ["KINDS", "schema"]
