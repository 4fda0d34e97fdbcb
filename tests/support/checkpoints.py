"""Checkpoints of runs with other headers, and digests that fit them."""

import json

from openmm_cylchain.runs.run_directory import digest_of_checkpoint


def resealed(content, **changes):
    """The content of a checkpoint with some entries of its header changed, as if a run had written it so."""
    line, _, state = content.partition(b"\n")
    header = {**json.loads(line), **changes}
    del header["digest"]
    header["digest"] = digest_of_checkpoint(header, state)
    return json.dumps(header).encode() + b"\n" + state
