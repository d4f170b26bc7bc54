"""Which compiled program a set of effects is fitted in."""

from __future__ import annotations

from smajax.attribution.fit_programs import MOST_SHARED, grouped


def test_sets_that_share_most_effects_share_a_program() -> None:
    sets = [("latent_heat",), ("latent_heat", "radiation"), ("latent_heat", "creep")]
    assert grouped(sets, ()) == [(frozenset({"latent_heat", "radiation", "creep"}), sets)]


def test_a_program_that_was_compiled_before_is_used_again() -> None:
    ((program, its_sets),) = grouped([("creep",)], [("latent_heat", "radiation", "creep"), ("radiation", "creep")])
    assert (program, its_sets) == (frozenset({"radiation", "creep"}), [("creep",)])


def test_a_program_carries_few_effects_that_a_set_does_not_have() -> None:
    effects = ("latent_heat", "radiation", "creep", "slack", "sensor_gain", "sensor_drift", "ambient_drift")
    groups = grouped([(), *((one,) for one in effects)], ())
    assert [one for _, its_sets in groups for one in its_sets] == [(), *((one,) for one in effects)]
    assert all(len(program - set(one)) <= MOST_SHARED for program, its_sets in groups for one in its_sets)
    assert len(groups) == 2


def test_a_friction_that_sticks_has_a_program_without_others() -> None:
    """What jumps takes many iterations, which every run of a shared program would take."""
    groups = grouped([("stribeck_friction",), ("latent_heat",), ("latent_heat", "stribeck_friction")], ())
    assert [its_sets for _, its_sets in groups] == [
        [("stribeck_friction",), ("latent_heat", "stribeck_friction")],
        [("latent_heat",)],
    ]
