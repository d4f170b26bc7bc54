"""Whether the plan of `receding_horizon` is made within a control period."""
