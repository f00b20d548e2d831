#!/usr/bin/env bash
# Tests the wheel in bare systems with Python 3.10, 3.11, 3.12 and 3.13: tests/wheel_systems.sh FOLDER_OF_WHEELS [FOLDER_OF_SYSTEMS]
# Needs root and debootstrap. A system that exists in FOLDER_OF_SYSTEMS is used again.
set -euo pipefail
wheels=$(realpath "$1")
systems=$(realpath -m "${2:-target/systems}")
here=$(dirname "$(realpath "$0")")
scripts=/usr/share/debootstrap/scripts
mkdir -p "$systems"

for named in jammy=http://archive.ubuntu.com/ubuntu bookworm=http://deb.debian.org/debian \
    noble=http://archive.ubuntu.com/ubuntu trixie=http://deb.debian.org/debian; do
    suite=${named%%=*} url=${named#*=} root=$systems/${named%%=*}
    if ! [ -x "$root/usr/bin/python3" ]; then
        # A debootstrap that is older than the suite knows how to install the one before it.
        case $url in *ubuntu) components=main,universe like=jammy ;; *) components=main like=bookworm ;; esac
        [ -e "$scripts/$suite" ] && like=$suite
        debootstrap --no-check-gpg --variant=minbase --components=$components --include=python3,python3-venv,ca-certificates \
            "$suite" "$root" "$url" "$scripts/$like" >"$root.log" 2>&1 || { tail "$root.log"; exit 1; }
    fi
    # Packages are fetched with the certificates and names of this machine.
    cp /etc/resolv.conf "$root/etc/"
    cp /etc/ssl/certs/ca-certificates.crt "$root/etc/ssl/certs/"
    rm -rf "$root/test" && mkdir "$root/test"
    cp -r "$wheels" "$root/test/wheels" && cp "$here/wheel.py" "$root/test"
    echo "$suite: $(chroot "$root" python3 --version), $(chroot "$root" ldd --version | sed -n '1s/.* /glibc /p')"
    chroot "$root" python3 /test/wheel.py /test/wheels
done
