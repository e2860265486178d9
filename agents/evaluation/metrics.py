"""Metrics of recorded runs, defined once for every table: energies, errors, forces, return."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from agents.evaluation.recording import Recording

Array = NDArray[np.float64]

# Returns are summed on the default environment's grid, whatever the controller's rate, so that they compare.
RETURN_PERIOD = 0.02


@dataclass(frozen=True)
class Regime:
    """Start of a run and the part of it that counts."""

    name: str
    start: str
    """The environment's `start`."""
    since: float
    """Time from which the run counts, to its end [s]."""
    meaning: str


REGIMES = (
    Regime("A", "paper", 0.0, "reach and track: paper's pose, 0-5 s"),
    Regime("B", "paper", 2.0, "track: paper's pose, 2-5 s"),
    Regime("C", "on_target", 0.0, "on target from the start, 0-5 s"),
)

UNITS = {
    "electrical_energy": "J",
    "drawn_energy": "J",
    "copper_loss": "J",
    "link_work": "J",
    "error_rms": "mm",
    "error_mean": "mm",
    "error_max": "mm",
    "z_rms": "mm",
    "peak_voltage": "V",
    "peak_current": "A",
    "smallest_elbow_force": "N",
    "below_table": "s",
    "voltage_change": "V",
    "return": "-",
}


def joint_energies(recording: Recording, since: float = 0.0) -> Array:
    """Signed electrical energy of each joint from `since` on [J], (B, n)."""
    return recording.electrical_energy[-1] - recording.electrical_energy[_first(recording, since)]


def metrics(recording: Recording, since: float = 0.0) -> dict[str, Array]:
    """The metrics of every episode from `since` seconds on, each (B,), in `UNITS`.

    Errors are taken at the recorded instants after `since`; a run without elbows has NaN for its elbow force, negative
    forces pull on the table. Raises ValueError unless `since` lies inside the run.
    """
    k = _first(recording, since)
    error = recording.hand[k + 1 :] - recording.target[k + 1 :]
    distance = np.linalg.norm(error, axis=-1)
    force = recording.elbow_force[k:]
    return {
        "electrical_energy": joint_energies(recording, since).sum(axis=-1),
        "drawn_energy": (recording.drawn_energy[-1] - recording.drawn_energy[k]).sum(axis=-1),
        "copper_loss": (recording.copper_loss[-1] - recording.copper_loss[k]).sum(axis=-1),
        "link_work": (recording.link_work[-1] - recording.link_work[k]).sum(axis=-1),
        "error_rms": 1e3 * np.sqrt((distance**2).mean(axis=0)),
        "error_mean": 1e3 * _on_grid(recording, k)[1].mean(axis=0),
        "error_max": 1e3 * distance.max(axis=0),
        "z_rms": 1e3 * np.sqrt((error[..., 2] ** 2).mean(axis=0)),
        "peak_voltage": np.abs(recording.voltage[k + 1 :]).max(axis=(0, 2)),
        "peak_current": np.abs(recording.current[k:]).max(axis=(0, 2)),
        "smallest_elbow_force": force.min(axis=(0, 2)) if force.shape[2] else np.full(force.shape[1], np.nan),
        "below_table": recording.below_table[-1] - recording.below_table[k],
        "voltage_change": _voltage_change(recording, k),
        "return": _return(recording, k),
    }


def _first(recording: Recording, since: float) -> int:
    if not 0.0 <= since < recording.time[-1]:
        raise ValueError(f"since must lie in [0, {recording.time[-1]:g}) s, got {since}")
    return int(np.searchsorted(recording.time, since - 1e-9))


def _on_grid(recording: Recording, k: int) -> tuple[NDArray[np.int64], Array]:
    """Indices of the return's instants from k on, and the tracking error [m] at all but the first."""
    stride = max(1, round(RETURN_PERIOD / recording.time[1]))
    grid = np.arange(k, recording.time.size, stride)
    return grid, np.linalg.norm(recording.hand[grid[1:]] - recording.target[grid[1:]], axis=-1)


def _voltage_change(recording: Recording, k: int) -> Array:
    """Smoothness of control: root mean square change of the terminal voltages over `RETURN_PERIOD` [V], (B,)."""
    # Before the first decision there is no voltage to change.
    voltage = recording.voltage[_on_grid(recording, k)[0][1:]]
    if len(voltage) < 2:
        return np.zeros(voltage.shape[1])
    return np.sqrt((np.diff(voltage, axis=0) ** 2).mean(axis=(0, 2)))


def _return(recording: Recording, k: int) -> Array:
    grid, error = _on_grid(recording, k)
    meter = recording.electrical_energy if recording.settings.regeneration else recording.drawn_energy
    energy = meter.sum(axis=-1)[grid[-1]] - meter.sum(axis=-1)[grid[0]]
    settings = recording.settings
    return -(settings.tracking_weight * error.sum(axis=0) + settings.energy_weight * energy / RETURN_PERIOD)
