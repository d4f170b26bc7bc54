"""Which compiled program a set of effects is fitted in."""

from __future__ import annotations

from smajax.attribution.fit_programs import compiled_for, grouped

FEW, MANY = 2_000, 100_000  # samples


def test_sets_that_share_most_effects_share_a_program() -> None:
    sets = [("latent_heat",), ("latent_heat", "radiation"), ("latent_heat", "creep")]
    assert grouped(sets, (), FEW) == [(frozenset({"latent_heat", "radiation", "creep"}), sets)]


def test_a_program_that_was_compiled_before_is_used_again() -> None:
    compiled = [("latent_heat", "radiation", "creep"), ("radiation", "creep")]
    assert grouped([("creep",)], compiled, FEW) == [(frozenset({"radiation", "creep"}), [("creep",)])]
    assert compiled_for(("creep",), compiled, FEW) == ("radiation", "creep")


def test_the_more_samples_there_are_the_fewer_effects_a_program_carries_that_a_set_does_not_have() -> None:
    effects = ("latent_heat", "radiation", "creep", "slack", "sensor_gain", "sensor_drift", "ambient_drift")
    sets = [(), *((one,) for one in effects)]
    assert len(grouped(sets, (), FEW)) == 1
    groups = grouped(sets, (), MANY)
    assert sorted(one for _, its_sets in groups for one in its_sets) == sorted(sets)
    assert all(frozenset(one) <= program for program, its_sets in groups for one in its_sets)
    assert 1 < len(groups) <= len(sets)
    compiled = [("latent_heat", "radiation", "creep", "transformation_curve")]
    assert compiled_for(("creep",), compiled, MANY) == ("creep",)


def test_what_makes_runs_much_slower_is_not_carried_for_many_sets_without_it() -> None:
    light = [("latent_heat",), ("radiation",), ("creep",), ("slack",), ("sensor_gain",), ("sensor_drift",)]
    shapes = [("transformation_curve",), ("smooth_transformation",)]
    groups = grouped([*light, *shapes], (), 2 * FEW)
    assert [its_sets for _, its_sets in groups] == [light, shapes]


def test_a_friction_that_sticks_has_a_program_without_others_where_there_are_many_samples() -> None:
    """What jumps takes many iterations, which every run of a shared program would take."""
    sets = [("stribeck_friction",), ("latent_heat",), ("latent_heat", "stribeck_friction")]
    assert [its_sets for _, its_sets in grouped(sets, (), MANY)] == [
        [("stribeck_friction",), ("latent_heat", "stribeck_friction")],
        [("latent_heat",)],
    ]
