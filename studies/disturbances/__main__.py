"""`python -m studies.disturbances`."""

import sys

from studies.disturbances.run import main

main(sys.argv[1:])
