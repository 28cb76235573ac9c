#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# A device for bridge.cpp, in Python without packages: a handle in a simulated hand that is lowered and
# raised. Put your device's driver where the handle is.
#
#   python3 device/plugins/bridge_example.py --seconds 20 &
#   hapsix run peg-in-hole --device plugin:build/release/plugins/bridge.so --duration 5
import argparse, json, math, socket, time

options = argparse.ArgumentParser()
options.add_argument("--port", type=int, default=47807)
options.add_argument("--seconds", type=float, default=10)
options.add_argument("--press", type=float, default=0.01)  # how far it is lowered [m]
options = options.parse_args()

link = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
link.connect(("127.0.0.1", options.port))
link.setblocking(False)

z = v = 0.0
force, answered, start = 0.0, 0.0, time.monotonic()
number = 0
while (t := time.monotonic() - start) < options.seconds:
    number += 1
    want = -0.5 * options.press * (1 - math.cos(math.pi * t))
    if t - answered > 0.02:
        force = 0.0  # the host is silent
    v += 1e-3 / 0.3 * (force + 500 * (want - z) - 20 * v)
    z += 1e-3 * v
    try:
        link.send(json.dumps({"n": number, "p": [0, 0, z], "v": [0, 0, v]}).encode())
        while True:
            answer = json.loads(link.recv(2048))
            force, answered = answer["f"][2], t
    except (BlockingIOError, ConnectionRefusedError):
        pass
    time.sleep(max(0.0, start + 1e-3 * number - time.monotonic()))
print(f"{number} datagrams, {number / options.seconds:.0f} a second")
