"""Opening networks that onnxruntime runs."""

from typing import Any

from avlmaps.core.machine import usable_cores


def open_network(graph: bytes | str, most_threads: int = 1) -> Any:
    """Return a network, ready to run; raises what onnxruntime does, which has types of its own.

    Args:
        graph: the network, or the file of it.
        most_threads: that it computes on, where there are as many cores.
    """
    import onnxruntime

    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = min(most_threads, usable_cores())
    options.inter_op_num_threads = 1
    options.log_severity_level = 3
    # Threads that wait for the next frame leave the cores to decoding and fusion: a build takes 0.6 of the time.
    options.add_session_config_entry("session.intra_op.allow_spinning", "0")
    return onnxruntime.InferenceSession(graph, options, providers=["CPUExecutionProvider"])
