# docker build -t cns-drake .
# docker run --rm -v "$PWD/output:/output" cns-drake reproduce metropolis --output /output
FROM python:3.12-slim-bookworm AS wheel
COPY . /source
RUN pip wheel --quiet --no-deps --wheel-dir /wheel /source/evaluation /source

FROM python:3.12-slim-bookworm
# Shared libraries of the wheels of Drake and Open3D.
RUN apt-get update -qq \
    && apt-get install -y -qq --no-install-recommends \
      libglib2.0-0 libgl1 libx11-6 libudev1 libgomp1 libusb-1.0-0 \
    && rm -rf /var/lib/apt/lists/*
COPY --from=wheel /wheel /wheel
RUN pip install --quiet --no-cache-dir /wheel/*.whl && rm -r /wheel
# Unpacked worlds and compiled loops; any user may write there.
ENV XDG_CACHE_HOME=/tmp/cache
ENTRYPOINT ["cns-drake"]
CMD ["list"]
