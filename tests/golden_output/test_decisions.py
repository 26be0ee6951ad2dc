"""What commands say that lead to decisions."""

from tests.golden_output import catalogue_decisions as catalogue
from tests.golden_output.same import test_output_is_that_of_the_golden_file as test_output_is_that_of_the_golden_file

CAMPAIGNS = (catalogue.DECIDED, catalogue.RARE, catalogue.WHAT_IF, catalogue.CHANGE)
