"""`python -m smajax` is `smajax`."""

from smajax.cli import main

main()
