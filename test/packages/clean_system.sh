# Clean systems of a release of Debian, in folders, for tests of packages: to be sourced, with $suite, and $out, the folder where they lie.

if [[ $(id -u) -ne 0 ]]; then
  echo "$0: needs root, to make a system of Debian's" >&2
  exit 77
fi
mkdir -p "$out"

cannot_be_had() {
  echo "$0: the packages of $suite cannot be had here" >&2
  exit 77
}

# The system that all others begin as.
base=$out/base.tar.gz
if [[ ! -e $base ]]; then
  rm -rf "$out/base"
  # What it mounts there ends with the namespace, also if it is killed.
  if ! unshare --mount debootstrap --variant=minbase "$suite" "$out/base" >"$out/debootstrap.log" 2>&1; then
    tail -n 5 "$out/debootstrap.log"
    ! grep -q 'Failed getting release file' "$out/debootstrap.log" || cannot_be_had
    exit 1
  fi
  tar -C "$out/base" -czf "$base.partial" .
  mv "$base.partial" "$base"
  rm -rf "$out/base"
fi

# new_system NAME: a clean one in $out/NAME, with an ordinary user, that knows which packages there are.
new_system() {
  rm -rf "${out:?}/$1"
  mkdir -p "$out/$1"
  tar -C "$out/$1" -xzf "$base"
  cp /etc/resolv.conf "$out/$1/etc/"
  in_system "$1" useradd --create-home ann
  in_system "$1" apt-get update -qq -o APT::Update::Error-Mode=any || cannot_be_had
}

# in_system NAME COMMAND...: runs it there, as root. The folder becomes the root of a mount namespace, and not by chroot, which would
# take from users the right to have networks of their own.
in_system() {
  local name=$1
  shift
  # shellcheck disable=SC2016
  unshare --mount --pid --fork --kill-child bash -euc '
    system=$0
    mount --bind "$system" "$system"
    cd "$system"
    mount --rbind /dev dev
    mount --rbind /sys sys
    mount -t proc proc proc
    mount -t tmpfs tmpfs tmp
    mkdir -p before
    pivot_root . before
    umount -l /before
    cd /
    # Of the environment only the way to the network counts.
    exec env -i ${http_proxy:+http_proxy="$http_proxy"} ${https_proxy:+https_proxy="$https_proxy"} PATH=/usr/sbin:/usr/bin:/sbin:/bin HOME=/root LANG=C.UTF-8 DEBIAN_FRONTEND=noninteractive "$@"' "$out/$name" "$@"
}
