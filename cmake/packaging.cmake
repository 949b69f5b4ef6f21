# install, export, find_package(octosurf)
