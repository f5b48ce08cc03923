#!/bin/sh
# Has apt install the Debian of one day, from an archive with the layout of snapshot.debian.org.
#
#     tools/snapshot.sh ARCHIVE DATE        http://snapshot.debian.org/archive 20260912T000000Z
set -eu
archive=$1 date=$2
. /etc/os-release
keys=/usr/share/keyrings/debian-archive-keyring.gpg
[ -e $keys ] || keys=/usr/share/keyrings/debian-archive-keyring.pgp

rm -f /etc/apt/sources.list /etc/apt/sources.list.d/*
cat >/etc/apt/sources.list.d/snapshot.sources <<END
Types: deb
URIs: $archive/debian/$date
Suites: $VERSION_CODENAME $VERSION_CODENAME-updates
Components: main
Signed-By: $keys

Types: deb
URIs: $archive/debian-security/$date
Suites: $VERSION_CODENAME-security
Components: main
Signed-By: $keys
END
# The lists of a past day have expired, and the archive drops hasty readers.
printf '%s\n' 'Acquire::Check-Valid-Until "false";' 'Acquire::Retries "5";' >/etc/apt/apt.conf.d/snapshot
