# The command with its page, and the Python package, on Debian 12: docs/usage.md.
FROM debian:12 AS build
RUN apt-get update && apt-get install -y --no-install-recommends \
    g++ cmake ninja-build pkg-config \
    libeigen3-dev liboctomap-dev libcgal-dev libboost-dev robin-map-dev libpcl-dev \
    liblzf-dev zlib1g-dev libspng-dev libassimp-dev nlohmann-json3-dev \
    libprotobuf-dev protobuf-compiler libzstd-dev \
    libsqlite3-dev liblz4-dev libbz2-dev \
    libcli11-dev libembree-dev \
    pybind11-dev python3-dev python3-numpy \
    nodejs npm ca-certificates \
  && rm -rf /var/lib/apt/lists/*
WORKDIR /octosurf
# What the page is bundled of, by itself: a change of the sources does not fetch it again.
COPY web/package.json web/package-lock.json web/
RUN cd web && npm ci --no-audit --no-fund
COPY . .
# Compilers at a time; one takes up to 1 GB. Empty: as many as there are processors.
ARG JOBS=
RUN cmake -S . -B build/container -G Ninja -DCMAKE_BUILD_TYPE=Release -DOCTOSURF_UNITY_BUILD=ON -DOCTOSURF_BUILD_PYTHON=ON \
    -DOCTOSURF_BUILD_TESTS=OFF -DOCTOSURF_BUILD_BENCH=OFF \
  && cmake --build build/container --target octosurf_app octosurf_lab_app octosurf_python --parallel ${JOBS}
# The packages of the libraries that these are linked with: ldd has /lib/… where dpkg may have /usr/lib/….
RUN ldd build/container/bin/octosurf build/container/bin/octosurf-lab build/container/python/octosurf/*.so | sed -n 's/^.* => \(\/\S*\) .*/*\1/p' | sort -u \
  | xargs dpkg-query -S | cut -d: -f1 | sort -u > packages

FROM debian:12-slim
COPY --from=build /octosurf/packages /tmp/packages
RUN apt-get update \
  && xargs apt-get install -y --no-install-recommends python3 python3-numpy < /tmp/packages \
  && rm -rf /var/lib/apt/lists/* /tmp/packages
COPY --from=build /octosurf/LICENSE /usr/share/doc/octosurf/
COPY --from=build /octosurf/build/container/bin/octosurf /octosurf/build/container/bin/octosurf-lab /usr/local/bin/
COPY --from=build /octosurf/build/container/python /usr/local/lib/python3.11/dist-packages
WORKDIR /data
CMD ["octosurf", "--help"]
