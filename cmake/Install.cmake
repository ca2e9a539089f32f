# Installs the project as components; deploy/packages turns each into a package. The folders follow
# GNUInstallDirs. PERDURE_SYSTEM_LIBDIR is the folder that systemd and udev read, relative to the
# prefix or absolute (Debian 12: /lib).
include_guard()
include(GNUInstallDirs)
include(CMakePackageConfigHelpers)

set(PERDURE_SYSTEM_LIBDIR lib CACHE STRING "Folder of systemd's units and udev's rules")
set(share ${CMAKE_INSTALL_DATADIR}/perdure)
set(etc ${CMAKE_INSTALL_FULL_SYSCONFDIR}/perdure)
set(state ${CMAKE_INSTALL_FULL_LOCALSTATEDIR}/lib/perdure)

# perdure_installed_config(FILE [OLD NEW]…): installs config/FILE. Each line OLD is replaced by NEW,
# because an installation has its files in other folders than the source tree.
function(perdure_installed_config file)
  file(READ ${PROJECT_SOURCE_DIR}/config/${file} text)
  set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/config/${file})
  while(ARGN)
    list(POP_FRONT ARGN old new)
    string(FIND "${text}" "${old}" place)
    if(place EQUAL -1)
      message(FATAL_ERROR "config/${file} has no \"${old}\" any more; fix cmake/Install.cmake")
    endif()
    string(REPLACE "${old}" "${new}" text "${text}")
  endwhile()
  file(WRITE ${PROJECT_BINARY_DIR}/etc/${file}.new "${text}")
  file(COPY_FILE ${PROJECT_BINARY_DIR}/etc/${file}.new ${PROJECT_BINARY_DIR}/etc/${file} ONLY_IF_DIFFERENT)
  install(FILES ${PROJECT_BINARY_DIR}/etc/${file} DESTINATION ${etc} COMPONENT services)
endfunction()

# The services, their configuration, and the files that the system needs to run them.
install(TARGETS perdure-capture perdure-vio perdure-inference perdure-semantic-filter
  perdure-map-store COMPONENT services)
perdure_installed_config(capture.yaml "state: \"\"         #" "state: ${state}/capture.json #")
perdure_installed_config(vio.yaml "directory: \"state\"" "directory: ${state}")
perdure_installed_config(inference.yaml "path: \"\"          #"
  "path: ${CMAKE_INSTALL_FULL_DATADIR}/perdure/models/perdure_320x240.onnx #")
perdure_installed_config(semantic_filter.yaml
  "class_priors: config/class_priors.yaml" "class_priors: ${etc}/class_priors.yaml")
perdure_installed_config(map_store.yaml "\"state/map.sqlite\"" "${state}/map.sqlite")
perdure_installed_config(bus.yaml)
perdure_installed_config(class_priors.yaml)
perdure_installed_config(class_aliases.yaml)
install(FILES deploy/roudi.toml DESTINATION ${etc} COMPONENT services)
# /usr/share/perdure has the layout of the source root: config, models, perdure_model.
install(CODE "
  set(folder \"\$ENV{DESTDIR}${CMAKE_INSTALL_FULL_DATADIR}/perdure\")
  file(MAKE_DIRECTORY \"\${folder}\")
  file(CREATE_LINK ${etc} \"\${folder}/config\" SYMBOLIC)" COMPONENT services)
install(DIRECTORY config/models/ DESTINATION ${share}/models COMPONENT services)
install(DIRECTORY deploy/systemd/ DESTINATION ${PERDURE_SYSTEM_LIBDIR}/systemd/system
  COMPONENT services FILES_MATCHING PATTERN "*.service" PATTERN "*.target" PATTERN "*.conf"
  PATTERN "perdure-gateway.service" EXCLUDE PATTERN "perdure-ros2.service" EXCLUDE)
install(FILES deploy/packages/host/60-perdure.rules
  DESTINATION ${PERDURE_SYSTEM_LIBDIR}/udev/rules.d COMPONENT services)
foreach(kind sysctl sysusers tmpfiles)
  install(FILES deploy/packages/host/${kind}.conf DESTINATION lib/${kind}.d RENAME perdure.conf
    COMPONENT services)
endforeach()

# The gateway, with its web page if npm built one.
install(TARGETS perdure-gateway COMPONENT gateway)
install(FILES deploy/systemd/perdure-gateway.service
  DESTINATION ${PERDURE_SYSTEM_LIBDIR}/systemd/system COMPONENT gateway)
install(FILES config/gateway.yaml DESTINATION ${etc} COMPONENT gateway)
install(DIRECTORY ${PROJECT_BINARY_DIR}/share/perdure/viewer DESTINATION ${share} COMPONENT gateway
  OPTIONAL)

# The bridge to ROS 2.
install(TARGETS perdure-ros2 COMPONENT ros2)
install(FILES deploy/systemd/perdure-ros2.service
  DESTINATION ${PERDURE_SYSTEM_LIBDIR}/systemd/system COMPONENT ros2)
install(FILES config/ros2.yaml DESTINATION ${etc} COMPONENT ros2)
install(DIRECTORY deploy/ros2/ DESTINATION ${share}/ros2 COMPONENT ros2)

# The command line tool, with the programs that `model import` runs.
install(TARGETS perdure COMPONENT tools)
get_property(commands GLOBAL PROPERTY PERDURE_COMMANDS)
install(TARGETS ${commands} DESTINATION ${CMAKE_INSTALL_LIBEXECDIR}/perdure COMPONENT tools)
install(DIRECTORY tools/model/perdure_model DESTINATION ${share} COMPONENT tools
  FILES_MATCHING PATTERN "*.py")
install(FILES config/simulated_detector.yaml config/simulated_tracker.yaml DESTINATION ${etc} COMPONENT tools)

install(DIRECTORY models/ DESTINATION ${share}/models COMPONENT models PATTERN README.md EXCLUDE)

# The Python module, if it was built, in the folder that Debian's python3 searches.
if(TARGET perdure_python)
  set(dist_packages lib/python3/dist-packages/perdure)
  install(TARGETS _perdure _map LIBRARY DESTINATION ${dist_packages} COMPONENT python)
  install(DIRECTORY tools/python/perdure/ DESTINATION ${dist_packages} COMPONENT python
    FILES_MATCHING PATTERN "*.py" PATTERN "*.pyi" PATTERN "py.typed" PATTERN "__pycache__" EXCLUDE)
  install(FILES tools/python/README.md DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/perdure-python
    COMPONENT python)
  install(PROGRAMS tools/python/examples/own_detector.py tools/python/examples/parked_cars.py
    tools/python/examples/plot_map.py
    DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/perdure-python/examples COMPONENT python)
endif()

# Files for third-party programs: find_package(Perdure), Perdure::idl, #include "idl/objects.h".
set(package ${CMAKE_INSTALL_LIBDIR}/cmake/Perdure)
set_target_properties(perdure_idl PROPERTIES EXPORT_NAME idl)
target_include_directories(perdure_idl SYSTEM INTERFACE
  $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}/perdure>)
install(TARGETS perdure_idl EXPORT PerdureTargets COMPONENT dev)
install(EXPORT PerdureTargets NAMESPACE Perdure:: DESTINATION ${package} COMPONENT dev)
install(DIRECTORY ${PROJECT_BINARY_DIR}/idl/idl DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/perdure
  COMPONENT dev FILES_MATCHING PATTERN "*.h")
install(DIRECTORY idl/ DESTINATION ${share}/idl COMPONENT dev FILES_MATCHING PATTERN "*.idl")
configure_package_config_file(cmake/PerdureConfig.cmake.in
  ${PROJECT_BINARY_DIR}/PerdureConfig.cmake INSTALL_DESTINATION ${package}
  PATH_VARS share)
write_basic_package_version_file(${PROJECT_BINARY_DIR}/PerdureConfigVersion.cmake
  COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/PerdureConfig.cmake
  ${PROJECT_BINARY_DIR}/PerdureConfigVersion.cmake DESTINATION ${package} COMPONENT dev)
install(FILES tools/examples/subscribe_objects.cpp tools/examples/inference_stub.cpp
  tools/examples/installed/CMakeLists.txt
  DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/perdure-dev/examples COMPONENT dev)
