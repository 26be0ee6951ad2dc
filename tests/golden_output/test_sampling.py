"""What commands say about joints of measured parts."""

from tests.golden_output import catalogue_decisions as catalogue
from tests.golden_output.same import test_output_is_that_of_the_golden_file as test_output_is_that_of_the_golden_file

CAMPAIGNS = (catalogue.PARTS,)
