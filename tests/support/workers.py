"""Jobs for processes, done in this one: starting a process costs seconds of imports."""

import pickle


def in_this_process(jobs, tell):
    """What `agents.workers.in_processes` gives, of jobs that could be sent to processes."""
    return {key: pickle.loads(pickle.dumps(job)).work(tell) for key, job in jobs.items()}
