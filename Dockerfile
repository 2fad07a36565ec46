# avlmaps on CPU: docker build -t avlmaps . && docker run --rm -v "$PWD":/data avlmaps query /data/home.avlmap "the sofa"
FROM python:3.12-slim
WORKDIR /app
COPY requirements/lock.txt requirements/lock.txt
RUN pip install --no-cache-dir --require-hashes -r requirements/lock.txt
COPY pyproject.toml README.md LICENSE NOTICE ./
COPY src src
COPY packages/avlmaps-sim packages/avlmaps-sim
RUN pip install --no-cache-dir --no-deps --no-build-isolation . ./packages/avlmaps-sim
RUN useradd --create-home robot
USER robot
WORKDIR /data
ENTRYPOINT ["avlmaps"]
CMD ["--help"]
