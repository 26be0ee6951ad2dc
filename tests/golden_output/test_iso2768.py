"""What commands say about the main study."""

from tests.golden_output import catalogue
from tests.golden_output.same import test_output_is_that_of_the_golden_file as test_output_is_that_of_the_golden_file

CAMPAIGNS = (catalogue.MAIN,)
