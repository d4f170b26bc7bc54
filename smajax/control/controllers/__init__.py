"""Controllers: a measured state and a reference, once a control period, to a voltage.

In: `MeasuredState`, `Reference`, the period (s). Out: the command (V) and the controller's own state. Each is a module with
gains as parameters; `control.presets.CONTROLLERS` has them by name with their gains. Public: `base.AbstractController`, and
`pid.Pid`, `vsc1.Vsc1`, `vsc2.Vsc2`, `vsc3.Vsc3`, `temperature_vsc.TemperatureVsc`, `stress_sliding.StressSliding`,
`backstepping_one.BacksteppingOne`, `backstepping_two.BacksteppingTwo`, `feedforward_pi.FeedforwardPi`, `receding_horizon.RecedingHorizon`.
"""
