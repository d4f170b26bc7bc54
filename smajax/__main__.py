"""`python -m smajax` is `smajax`."""

from smajax.cli.main import main

main()
