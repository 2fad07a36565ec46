"""Depth codecs: LZFSE against streams of Apple's own encoder, RVL against its paper."""

import base64

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from avlmaps.core.lzfse import decompress
from avlmaps.core.rvl import decode_rvl
from helpers.format_writers import plain_lzfse, rvl

# Made by the reference encoder: LZVN (100 zeros; a phrase over and over) and LZFSE (numbers of a sine, several blocks).
ZEROS = "YnZ4bmQAAAAQAAAAaAEA8EniAAAGAAAAAAAAAGJ2eCQ="
PHRASE = (
    "YnZ4bggHAABCAAAA7XRoZSBraXRjaGVuLCAIDeloYWxsIGFuZCA4GvHoIGFnYWluOyA4LfD/8P/w//D/8P/w//Bk4247IAYAAAAAAAAAYnZ4JA=="
)
STEPS = (
    "YnZ4MgAAAwDkBfBIACUGYAEE0Ow84QZAtAAAAD+MgA/9EUQAAABAAAAAQN4EfhthAgAAAAAAkAEAAAAAAAAAMIE74Ay4A+6AO+AM"
    "uAPugDvgDrgD7oAz4A64A+6UM+AOuAPugDvgDrgDzoA74A64A86AO+AOuAPuuOOOM+64444z7rjjjjvuuOOMOy6544w7brnjjjtu"
    "OeOMIy7ZTAZHCMAJAHAEAJwBAFcAwBUAcAUAnAEAAAAAAAEEAbqpZ5kkCt++ukwkUXj7iuoykUTh21eUiSSIt68oJBNJEG9fUUgm"
    "kiDeviJkJEG4X1EIL5Ig3K8ohBdJEO5XhOQlCNeLQnitBOF6EZLXIlwPQngtD+F6EMJreQjXg5C8lud6kMFreQ7Xgwxey3O4HmTw"
    "Wt7hQcbe8hy7Bxl6y3PsHmToLe/YIWNfeY4dhAx95R07aOwr7thBz9BX3LGDnqGvuGMHvX3FFTvoLfqKK3bQW/QVV+ygt6y4Qge9"
    "pV9xRQ56S7/iihz0lp4rdNZbepgrctZberjQWW7pYbDIWW7pYbDIWW7pYVBnuaSHwShnuaSHwShnuaSHwYjlEh4Go4DlEh4Go4BL"
    "+BeMAplLeBeMAplLeBeMAjnhXy8K5DHhXS8K5DHhXS8K5JF/vSeQR4p3vSeQR4p3vSeQR+r1HkAeqcP1HkAeqcN7gHikDtt7AHik"
    "Dtt7AHikDvsB4pA67PMB4JA67PMB4JA67BOIQ+mwTwyAQ+mwTwyAQ+mwTywOpcI+sQUOpcI+sSWUivrEFj2UCvrEFj2UCvrEFl0q"
    "6hJb9FUq6BJb9FUq6BJb9LWoS2vRV66gS2vRV64urURfuYYurURfuYYurURfuaa0knzlmr60Enzlmr60Enzlmt5K8pRretdK8JRr"
    "etdK8JRrejfJU63p3TDBU63p3TBPtaV3wwhPtaV3wwhPtaV3wyjVFt4NoyDVFt4NoyDVFt4No0Bb+DaMAllbeDaMAllbeDaMAnnh"
    "2y8K5HLh2S8K5JJvvyeQy4pnvyeQy4pnvyeQy6r9HkAuK4P9HkAuK4P9HkAuK+N7gLisDPt7ALisDPsB4rEy7PMB4LEy7PMB4LEy"
    "7BOIx8mwTwyAx8mwTwyAx8mwTyweJ8I+sQQeJ8I+sQQeJ8I+sWSciPrEkn2cCPrEkn0i6hJL9nQi6BJL9nQi6BJL9pSoSyvZU42g"
    "SyvZU42gSyvZU60urWNPtYUurWNPtYUurWNPtaW0Dj3Vlr60jjzVlt469FNb+tY68lNb+tY68lNb+vbQT2zpW+/IT2zpW+/IT2zp"
    "W08/saRvvSc/saRvvefEEr71nv/Ekr31nv/Ekr31nh9L+NV7fhhL9tV7fhhL9tV7fjjhV+754TDZV+754TDZV+754ZBfueaHQ2pf"
    "ueaHQ2rlGh8OqWHlGh8OqWHlGh8OqYFr/DekBpprfDekBpprfDekBrrx348a6LLx3Y8a6LLx3Y8a6NJ/P2mgS8x3P2mgS+z9JIEu"
    "McT9JIEuMcT9JIEuMeSThFmJIcInCbMSQ4RPEmYlhgiSMJMYIgkziSHCTF4IXZhJC6ELM2kh9Jm8DDp6Ji2Djp5Jy6CjycuYo7ek"
    "ZczRW9Iy5ujtZczPW6dlzM9bpzE/a50+Y37WOn3G/Kx1+uZnbdNHm5+1b/bR6GB+9jp9NNb8rG36aKzO/Kxt+miszvysbfporM5Z"
    "2/RprE7hrG36NFanoG36NKtTQGqb/szqFJDapj+zOgVk06fXTgGJaPrz2ikgEU1/XjsFJMKnV66ARDT9ed0KSETTn9fNCyQEAAAA"
    "AAAAAAAAQKKjo6OjoyNHR0dHR0dHR44cHR05OjpydHR0dHR0dPToyNHR0dHR0UdHR0dHR0eOjo4eHR0dHT06OjpydHR09Ojo6NHR"
    "0ZGjo6Ojo6Ojo46Ojo4eHR0dPTo6Ojo6OnJ0dHTk6NHR0aOjo6Ojo6OjR0dHR0ePjjg6Ojo6Ojo6enR0dHR09Ojo0dGRo6OjI0dH"
    "R0dHR0ePHh0dHR0dHTl6dHR0dHR01NHR0dHR0dHRo6MjR0dHR0cfHR0dHR0dOTo6Ojo6OnL06NHR0dHR0dGjo6Ojo6MjR0ePHB0d"
    "HR09Ojo6Ojo6Onp09Ojo6MiRo6Ojo6Ojo6NHR0ePjo6Ojh4dOTo6OjpydHR09Ojo6OjR0dHR0ZGjo0dHR0ePjo4cHR0dHR0dHT06"
    "cnR09Ojo6NHR0dHR0ZGjo6Ojo6OOjh4dHR0dHR0dPTo6Ojo6euToyNHR0dHR0aOjo6Ojo6NHj46Ojo4cHTk6Ojo6Ojo6+ujo6Ojo"
    "6OjokaOjo6OjI0ePjo6Ojo6OHh0dHR05Ojp69Ojo6OjoyNHR0dHR0dHRI0ePjo6Ojo4eHR0dHR0dOTo6enTk6Ojo0dHR0dHR0dGj"
    "o6NHR0dHjhwdHR0dHR09Ojo6enR0dPTo6OjI0dGRo6Ojo6NHR0ePjo6Ojo6Ojjo6Ojo6enTk6Ojo6Ojo6OjR0dGRo6NHR4+Ojo6O"
    "jo4cHR0dHR0dPero6Ojo6Ojo6NHR0dHR0VFHR0dHjo6Ojh4dHR0dHR0dfXR0dHR0dMTR0dHR0dHR0aNHR0dHR0dHj46OHB0dHTk6"
    "enR0dHR09Ojo6Ojo6MjRo6NHR0dHR46Ojo6Ojo6OHh0ddXR0dHT06Ojo6OjoyNHR0dGjoyNHj46Ojo6Ojo4eHR0dPTo6cnR05Ojo"
    "6Ojo0dHR0dGjo6NHR0dHR0eOHB0dHR0dPTp6dHR0dHR0dPToyNHR0dEjR0dHR0dHR0ePjo6Ojo4cPXp0dHR0dHTk6Ojo6Ojo6Oij"
    "I0dHR0dHR4+Ojo6Ojo4cPTo6OjpydPTo6Ojo6Ojo6NGjo6OjoyNHR46Ojo6Ojh4dPTo6Ojo6enR0dHTk6MjR0dGjo6Ojo0dHR0dH"
    "R0dHjxwdPTo6OnJ0dHR0dHR09Ojo6OiRo6OjR0dHR0dHR46Ojo6OHh0dPXJ0dHR0dHT06Ojo6OjRkaOjo6MjR0dHj46Ojo6OHh09"
    "Ojo6Ojo6cuTo6Ojo6OjRo6Ojo6Ojo6NHR0dHjo6OOjo6Ojo6Ojp6dHR0dHR0dLSjo6Ojo6MjR0dHR0dHR0ePHh0dOTo6Onp0dHR0"
    "dHTk6OjR0dHR0VFHR0dHR0dHR4+OHh0dHR05Ojo6cnR0dPTo6OjR0dHR0aOjo6OjoyOOjo6OHh0dHT06Ojo6Ojo6enR05OjR0ZGj"
    "o6Ojo6Ojo0dHR0dHj44cPTo6Ojo6OnJ0dHR0dPTo6NHRkaOjo6OjR0dHR0dHjxwdHR0dHR05enR0dHR0dPTo0dHR0dHRkaOjI0dH"
    "R0dHHx0dHR0dHR09Ojo6Ojpy5OjR0dHR0dHRo6Ojo6Ojo6NHjxwdHR0dOTo6Ojo6Ojp6dPTo6OjI0dGjo6Ojo6MjR0dHj46Ojo4e"
    "HTk6Ojo6Onp0dPTo6OjI0dHR0dGRo6NHR0dHj46Ojh4dHR0dHR05OnJ0dPTo6OjR0dHR0dHR0aOjo6Ojjo4cHR0dHR0dHT06Ojo6"
    "Onp09MjR0dHR0ZGjo6Ojo6OjR4+Ojo6OHB0dPTo6Ojo6Ouro6Ojo6Ojo6JGjo6OjI5imYm7+4KcJTM0iHh0dHR0daTQRg2cHdprA"
    "1FnEo6OjoyOeJmFuZvAIo0mMzSQeHR0dHQE0CYMzg0cYTWJsJvHo6OjoCKBJGDwzeETRJMbOJB4dHR2JNAFzs4JHRzJNYGw28ujo"
    "6MikCZibFTw6kmkCY7ORR0dHRyZNwNxZwaMjlyYwdjby6OgIoUnMzUgeHR0xNIm5GcmjoyOGJjE3I3l0dMTQJOZmJI+OjhiaxNwZ"
    "yaOjI4QmMXdG8ujIpQmMzUYeHR0dmTQBc7OCR0cyTWDsbOTR0dGRSBMwd1bwiKJJjM0kHh0dHR0BNAmDM4NHGE1ibCbx6Ojo6Aig"
    "SRicGTzCaBJjZxKPjo6OjniahLkzAztNYGoW8ejo6OjoSKOJGJwd+GkCU7OIR0dHR0dHGk3E4OygUXDk6Ojo6Ojo6NHR0dHR0dGj"
    "R4+Ojo6Ojo4eHR0dHR0dcXR0dHT06Ojo0dHR0dHR0dFHR0dHR0dHjhwdHR0dHR09enR0dHR0dPTo6Ojo0dGRo6NHR0dHR0ePjo6O"
    "jo6Ojj46enR0dHTk6Ojo6Ojo6OjR0dGjR0dHR4+OECMLYnZ4JA=="
)


def steps() -> bytes:
    """Return a picture of steps, as floats: 196,608 bytes."""
    rows, columns = np.floor(np.linspace(20, 90, 192))[:, None], np.floor(np.arange(256) / 32)[None]
    return (rows + columns).astype("<f4").tobytes()


@pytest.mark.parametrize(
    ("stream", "true"),
    [(ZEROS, bytes(100)), (PHRASE, b"the kitchen, the hall and the kitchen again; " * 40), (STEPS, steps())],
    ids=["LZVN", "LZVN of a phrase", "LZFSE"],
)
def test_streams_of_the_reference_encoder_unfold(stream: str, true: bytes) -> None:
    content = base64.b64decode(stream)
    assert decompress(content, len(true)) == true
    with pytest.raises(ValueError, match="it unfolds to"):
        decompress(content, len(true) - 1)


@given(cut=st.floats(0, 0.999), flip=st.integers(0, 10_000), stream=st.sampled_from([PHRASE, STEPS]))
def test_a_damaged_stream_is_a_value_error_or_unfolds(cut: float, flip: int, stream: str) -> None:
    content = bytearray(base64.b64decode(stream))
    content[flip % len(content)] ^= 1 << flip % 8
    try:
        unfolded = decompress(bytes(content), 200_000)
    except ValueError:
        unfolded = b""
    assert len(unfolded) <= 200_000
    with pytest.raises(ValueError):
        decompress(base64.b64decode(stream)[: int(cut * len(content))], 200_000)


def test_plain_blocks_follow_one_another() -> None:
    assert decompress(plain_lzfse(b"one" * 999), 2997) == b"one" * 999


@given(arrays(np.uint16, (6, 7), elements=st.integers(0, 65535) | st.just(0)))
def test_rvl_gives_back_every_depth(depth: np.ndarray) -> None:
    content = rvl(depth)
    assert np.array_equal(decode_rvl(content, 7, 6), depth)
    if depth.any():
        with pytest.raises(ValueError, match="too few for 7x6"):
            decode_rvl(content[:-4], 7, 6)
