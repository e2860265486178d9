"""The paper's conclusions as statements that measured numbers confirm or refute; nothing here knows the answer."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise

from agents.paper.subject import cases_in_words
from agents.style import elbow_name

# The paper calls the three curves of link work "the same"; within a quarter they count as alike, beyond it they do not.
ALIKE = 1.25
NUMBER_WORDS = {2: "two", 3: "three", 4: "four"}
"""Numbers of cases in words."""
OTHER_ARM = (
    "All five statements are the paper's about its own arm on joints 4 and 7, driven by gains for that arm's motors. "
    "Here the same PD with the same gains drives another arm or leans on other joints, so that a verdict says nothing "
    "for or against the paper. The paper's published numbers hold for its arm alone and are left out."
)
"""Beginning of a verdict on another arm, before the statements."""


@dataclass(frozen=True, kw_only=True)
class Numbers:
    """Energies, errors and forces of one elbow count under the paper's PD."""

    elbow_joints: tuple[int, ...]
    """Joint numbers held on the table."""
    energy: float
    """Signed electrical energy of the whole run [J]."""
    joint_energy: tuple[float, ...]
    """Signed electrical energy of each joint in the whole run [J]."""
    joint_1_first_second: float
    """Signed electrical energy of joint 1 in the run's first second [J]."""
    energy_tracking: float
    """Signed electrical energy from t = 2 s on [J]."""
    link_work: float
    """Link work of the whole run [J]."""
    link_work_tracking: float
    """Link work from t = 2 s on [J]."""
    error_rms: float
    """Root mean square of the hand's error from t = 2 s on [mm]."""
    z_rms: float
    """Root mean square of the error's vertical part from t = 2 s on [mm]."""
    z_mean: float
    """Mean height of the hand over the target from t = 2 s on [mm]; negative where it sags."""
    energy_on_target: float
    """Signed electrical energy of the whole run when it starts on the target [J]."""
    energy_clipped: float
    """Signed electrical energy of the whole run with the voltage clipped to 24 V, at 2 kHz [J]."""
    force_mean: tuple[float, ...]
    """Mean force of the table on each elbow from t = 2 s on [N]; negative where it pulls."""
    force_smallest: tuple[float, ...]
    """Smallest force of the table on each elbow over the whole run [N]."""
    below_table: float
    """Time that some joint or the hand spent under the table's height [s]."""


@dataclass(frozen=True)
class Claim:
    """A statement of the paper and whether the numbers bear it out."""

    name: str
    statement: str
    holds: bool
    evidence: str


Cases = Mapping[int, Numbers]
"""Numbers by elbow count, largest first, down to 0."""


def verdict(cases: Cases) -> list[Claim]:
    """The paper's five claims, judged by the numbers of its cases alone."""
    return [_tracking(cases), _height(cases), _work(cases), _toward_the_base(cases), _energy(cases)]


def _falls_with_elbows(values: Mapping[int, float]) -> bool:
    return all(values[elbows] < values[elbows - 1] for elbows in range(1, len(values)))


def _each(values: Mapping[int, float], unit: str) -> str:
    """Values of the cases, most elbows first throughout."""
    return " / ".join(_short(values[elbows]) for elbows in sorted(values, reverse=True)) + f" {unit}"


def _short(value: float) -> str:
    return f"{value:.0f}" if abs(value) >= 1000.0 else f"{value:.3g}"


def _tracking(cases: Cases) -> Claim:
    errors = {elbows: numbers.error_rms for elbows, numbers in cases.items()}
    return Claim(
        "tracking",
        "The more elbows, the more exactly the hand follows the circle.",
        _falls_with_elbows(errors),
        f"hand error rms for t > 2 s: {_each(errors, 'mm')}",
    )


def _height(cases: Cases) -> Claim:
    heights = {elbows: numbers.z_rms for elbows, numbers in cases.items()}
    free = cases[0]
    share = (free.z_rms / free.error_rms) ** 2
    worst = all(heights[0] > height for elbows, height in heights.items() if elbows)
    side = "under" if free.z_mean < 0.0 else "over"
    return Claim(
        "height",
        "Along z, where gravity acts, the arm without elbows is worst: it sags, and the hand with it.",
        worst and share > 0.5 and free.z_mean < 0.0,
        f"z error rms for t > 2 s: {_each(heights, 'mm')}; without elbows z makes {share:.1%} of the squared error "
        f"and the hand is on average {_short(abs(free.z_mean))} mm {side} the target",
    )


def _work(cases: Cases) -> Claim:
    def ratio(values: Mapping[int, float]) -> float:
        # A smallest value that is not positive makes no ratio: such values are not alike.
        return max(values.values()) / min(values.values()) if min(values.values()) > 0.0 else float("inf")

    work = {elbows: numbers.link_work for elbows, numbers in cases.items()}
    energy = {elbows: numbers.energy for elbows, numbers in cases.items()}
    late_work = {elbows: numbers.link_work_tracking for elbows, numbers in cases.items()}
    late_energy = {elbows: numbers.energy_tracking for elbows, numbers in cases.items()}
    alike = all(ratio(values) <= ALIKE for values in (work, late_work))
    apart = all(ratio(values) > ALIKE and values[0] == max(values.values()) for values in (energy, late_energy))
    return Claim(
        "work and energy",
        f"The work that the links do is alike in the {NUMBER_WORDS.get(len(cases), len(cases))} cases, the electrical "
        "energy is not: it is greatest without elbows.",
        alike and apart,
        f"link work {_each(work, 'J')} (largest over smallest {ratio(work):.3g}; alike up to {ALIKE}), for t > 2 s "
        f"{_each(late_work, 'J')} ({ratio(late_work):.3g}); energy {_each(energy, 'J')} "
        f"({ratio(energy):.3g}), for t > 2 s {_each(late_energy, 'J')} ({ratio(late_energy):.3g})",
    )


def _toward_the_base(cases: Cases) -> Claim:
    evidence, holds = [], True
    most = max(cases)
    pairs = [(elbows, elbows + 1) for elbows in range(most)]
    for fewer, more in pairs if most == 1 else [*pairs, (0, most)]:
        relieved, already = cases[more].elbow_joints[-1], (1, *cases[fewer].elbow_joints)[-1]
        # An elbow cannot relieve joints that another one before it relieves already; joint 1 has a vertical axis.
        joints = range(max(2, already), relieved)
        gaps = [cases[fewer].joint_energy[j - 1] - cases[more].joint_energy[j - 1] for j in joints]
        holds = holds and gaps[-1] > 0.0 and all(inner > outer for inner, outer in pairwise(gaps))
        listed = ", ".join(_short(gap) for gap in gaps)
        evidence.append(f"{fewer} against {more}, joints {joints[0]} to {joints[-1]}: {listed} J")
    yaw = cases[0].joint_energy[0] - cases[most].joint_energy[0]
    outer = cases[most].elbow_joints[-1]
    rest = sum(cases[0].joint_energy[outer - 1 :]) - sum(cases[most].joint_energy[outer - 1 :])
    return Claim(
        "toward the base",
        "Of the joints before an elbow, those nearer to the base save more energy by it. "
        "Joint 1 is excepted: its axis is vertical, so gravity does not load it.",
        holds,
        f"energy saved by elbows, {'; '.join(evidence)}. For comparison, 0 against {most}: joint 1 {yaw:.3g} J, "
        f"joints {outer} to {len(cases[0].joint_energy)} together {rest:.3g} J",
    )


def _energy(cases: Cases) -> Claim:
    readings = {
        "whole run": {elbows: numbers.energy for elbows, numbers in cases.items()},
        "t > 2 s": {elbows: numbers.energy_tracking for elbows, numbers in cases.items()},
        "started on target": {elbows: numbers.energy_on_target for elbows, numbers in cases.items()},
        "clipped to 24 V": {elbows: numbers.energy_clipped for elbows, numbers in cases.items()},
    }
    first = {elbows: numbers.joint_1_first_second for elbows, numbers in cases.items()}
    shares = {elbows: 100.0 * first[elbows] / numbers.energy for elbows, numbers in cases.items()}
    return Claim(
        "energy",
        "So an arm on its elbows does the task with less energy, however the run is counted.",
        all(_falls_with_elbows(values) for values in readings.values()),
        "; ".join(
            f"{name} {_each(values, 'J')}" + ("" if _falls_with_elbows(values) else " (does not fall with elbows)")
            for name, values in readings.items()
        )
        + f". Joint 1's first second alone is {_each(shares, '%')} of the whole run's energy and differs by at most "
        f"{_short(max(first.values()) - min(first.values()))} J between the cases; hence the other readings",
    )


def disclosures(cases: Cases) -> list[str]:
    """Facts that qualify the paper's conclusions, from the same numbers."""
    notes = []
    for elbows in sorted(set(cases) - {0}, reverse=True):
        numbers = cases[elbows]
        for joint, mean, smallest in zip(numbers.elbow_joints, numbers.force_mean, numbers.force_smallest, strict=True):
            name = f"joint {joint} with {elbow_name(elbows)}"
            forces = f"mean {mean:.3g} N for t > 2 s, smallest {smallest:.3g} N over the run"
            if mean < 0.0:
                notes.append(f"The table pulls on {name} on average: {forces}.")
            elif smallest < 0.0:
                notes.append(f"The table pulls on {name} for moments: {forces}.")
            else:
                notes.append(f"The table only pushes on {name}: {forces}.")
    if any(force < 0.0 for numbers in cases.values() for force in numbers.force_smallest):
        notes.append("A real table cannot pull; the paper's constraint z = 0 is bilateral and can.")
    below = {elbows: numbers.below_table for elbows, numbers in cases.items()}
    if max(below.values()) > 0.0:
        notes.append(
            f"Joints sink under the table's height for {_each(below, 's')} of the run: where the paper has no "
            "elbow it has no table either."
        )
    return notes


def as_markdown(cases: Cases, other: str | None = None) -> str:
    """The claims and disclosures as a Markdown document.

    Args:
        cases: the numbers that decide.
        other: description of the arm where it is not the paper's on the paper's elbows.
    """
    number = NUMBER_WORDS.get(len(cases), str(len(cases))).capitalize()
    legend = f"{number} values stand for {cases_in_words(list(cases))}. Every verdict is computed from the run."
    if other is None:
        lines, fails = ["# Does the paper hold?", "", legend, ""], "FAILS"
    else:
        title = "# Do the paper's statements hold on another arm?"
        lines, fails = [title, "", f"Arm: {other}.", "", OTHER_ARM, "", legend, ""], "Does not hold here"
    for number, claim in enumerate(verdict(cases), start=1):
        lines += [
            f"{number}. **{'Holds' if claim.holds else fails}** ({claim.name}). {claim.statement}",
            "",
            f"   Evidence: {claim.evidence}.",
            "",
        ]
    lines += ["To be known beside it:", "", *(f"- {note}" for note in disclosures(cases)), ""]
    return "\n".join(lines)
