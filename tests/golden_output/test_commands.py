"""What commands say that need no campaign, and their help."""

from tests.golden_output import catalogue
from tests.golden_output.same import test_output_is_that_of_the_golden_file as test_output_is_that_of_the_golden_file

CAMPAIGNS = (catalogue.HELP,)
