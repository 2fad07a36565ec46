"""A proxy of TCP between a client and a bridge, in a process of its own: it delays, slows down, cuts and swallows.

Orders come as lines on standard input: ``delay S``, ``rate BYTES_PER_S`` (0: no limit), ``cut``, ``hole``, ``up``
(swallow what the client says), ``open``.
"""

import asyncio
import sys
from collections.abc import AsyncIterator
from contextlib import suppress


class Way:
    """What happens to bytes on their way."""

    delay_s = 0.0
    rate = 0.0
    hole = False
    mute = False
    writers: "set[asyncio.StreamWriter]" = set()  # noqa: RUF012 - one proxy in a process


async def pumped(reader: asyncio.StreamReader, writer: asyncio.StreamWriter, down: bool) -> None:
    """Hand on bytes, later where they are to be late; a queue is bounded, as the buffers of sockets are."""
    loop = asyncio.get_running_loop()
    queue: asyncio.Queue[tuple[float, bytes]] = asyncio.Queue(200)

    async def read() -> None:
        while True:
            content = await reader.read(2048 if Way.rate else 65536)
            await queue.put((loop.time() + (Way.delay_s if down else 0.0), content))
            if not content:
                return

    reading = asyncio.ensure_future(read())
    try:
        while True:
            when_s, content = await queue.get()
            await asyncio.sleep(max(0.0, when_s - loop.time()))
            while Way.hole or (Way.mute and not down):
                await asyncio.sleep(0.05)
            if not content:
                break
            writer.write(content)
            await writer.drain()
            if Way.rate and down:
                await asyncio.sleep(len(content) / Way.rate)
    except (ConnectionError, OSError):
        pass
    finally:
        reading.cancel()
        writer.close()


async def served(reader: asyncio.StreamReader, writer: asyncio.StreamWriter, port: int) -> None:
    try:
        far_reader, far_writer = await asyncio.open_connection("127.0.0.1", port)
    except OSError:
        writer.close()
        return
    Way.writers |= {writer, far_writer}
    await asyncio.gather(pumped(reader, far_writer, False), pumped(far_reader, writer, True), return_exceptions=True)
    Way.writers -= {writer, far_writer}


async def orders() -> AsyncIterator[list[str]]:
    loop = asyncio.get_running_loop()
    while line := await loop.run_in_executor(None, sys.stdin.readline):
        yield line.split()


async def main(near: int, far: int) -> None:
    await asyncio.start_server(lambda reader, writer: served(reader, writer, far), "127.0.0.1", near)
    async for order in orders():
        with suppress(ValueError, IndexError):
            match order:
                case ["delay", value]:
                    Way.delay_s = float(value)
                case ["rate", value]:
                    Way.rate = float(value)
                case ["cut"]:
                    for writer in list(Way.writers):
                        writer.transport.abort()
                case ["hole"]:
                    Way.hole = True
                case ["mute"]:
                    Way.mute = True
                case ["open"]:
                    Way.hole = Way.mute = False
                    Way.delay_s = Way.rate = 0.0


if __name__ == "__main__":
    asyncio.run(main(int(sys.argv[1]), int(sys.argv[2])))
