"""The source's figures, drawn by smajax, each with the number that proves it: `smajax figures`."""
