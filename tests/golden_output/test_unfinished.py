"""What commands say about a campaign that has pending joints, about slices, and about what was merged from them."""

from tests.golden_output import catalogue
from tests.golden_output.same import test_output_is_that_of_the_golden_file as test_output_is_that_of_the_golden_file

CAMPAIGNS = (catalogue.PENDING, catalogue.SLICED)
