# docker build -t unitcad . && docker run --rm -v "$PWD":/work unitcad build encapsulating
FROM python:3.12-slim
COPY . /unitcad
WORKDIR /unitcad
RUN python3 -m venv .venv && .venv/bin/pip install -q --no-cache-dir -c constraints.txt ".[step,serve]"
ENV PATH="/unitcad/.venv/bin:$PATH"
RUN useradd --create-home maker
USER maker
WORKDIR /work
ENTRYPOINT ["unitcad"]
CMD ["--help"]
