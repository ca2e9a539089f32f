# To be sourced: the Debian mirrors in the apt sources of this machine. PERDURE_MIRROR and
# PERDURE_SECURITY_MIRROR override them.

# mirror_of RELEASE: prints the first source of this release.
mirror_of() {
  apt-get indextargets --format '$(REPO_URI) $(RELEASE) $(COMPONENT)' 'Created-By: Packages' 2> /dev/null |
    awk -v release="$1" '$2 == release && $3 == "main" { sub("/$", "", $1); print $1; exit }'
}
codename=$(. /etc/os-release && echo "${VERSION_CODENAME:-stable}")
mirror=${PERDURE_MIRROR:-$(mirror_of "$codename")}
security=${PERDURE_SECURITY_MIRROR:-$(mirror_of "$codename-security")}

# debian_sources RELEASE: prints the lines for the /etc/apt/sources.list of a root.
debian_sources() {
  printf 'deb %s %s main\n' "$mirror" "$1" "$mirror" "$1-updates"
  [ -z "$security" ] || printf 'deb %s %s main\n' "$security" "$1-security"
}
