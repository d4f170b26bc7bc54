"""Names of values that each run has of its own."""

from __future__ import annotations

from smajax.core.names_of_runs import is_of_run, of_run, parameter_of


def test_a_name_of_a_run_leads_back_to_its_parameter_whatever_the_run_is_called() -> None:
    for run in ("first", "50 MPa", "run [2]", "a]b["):
        name = of_run("austenite_start", run)
        assert is_of_run(name)
        assert parameter_of(name) == "austenite_start"
    assert not is_of_run("latent_heat.enthalpy")
    assert parameter_of("latent_heat.enthalpy") == "latent_heat.enthalpy"
