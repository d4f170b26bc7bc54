"""The steps of the way, one file each, in their order.

In: a `Project`, and a form. Out: what the template of the same name shows, or the step to go to next.
"""
