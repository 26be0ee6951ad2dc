"""What commands say about the other studies."""

from tests.golden_output import catalogue_studies as catalogue
from tests.golden_output.same import test_output_is_that_of_the_golden_file as test_output_is_that_of_the_golden_file

CAMPAIGNS = (
    *(catalogue.SWEEP, catalogue.BORED, catalogue.OVERNIGHT),
    *(catalogue.TRUCK, catalogue.ORDER, catalogue.UNLIKE, catalogue.RINGS),
    *(catalogue.FLAP, catalogue.FOURBAR, catalogue.CRANKS),
)
