"""How models are loaded while a verb runs, as its words say."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace


@contextmanager
def models_in_force(verb: object) -> Iterator[None]:
    """Load models as a verb's words say while it runs, here and in processes that it starts."""
    given = {
        "folder": getattr(verb, "models", None),
        "device": getattr(verb, "device", None),
        "precision": getattr(verb, "precision", None),
        "batch": getattr(verb, "batch", None),
    }
    given = {name: value for name, value in given.items() if value is not None}
    if not given:
        yield
        return
    from avlmaps.perception.models.settings import environment_of, model_settings, using_models

    if "folder" in given:
        given["folder"] = given["folder"].absolute()
    settings = replace(model_settings(), **given)
    variables = environment_of(settings)
    before = {name: os.environ.get(name) for name in variables}
    with using_models(settings):
        os.environ.update(variables)
        try:
            yield
        finally:
            for name, value in before.items():
                if value is None:
                    del os.environ[name]
                else:
                    os.environ[name] = value
