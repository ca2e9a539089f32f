# Builds the page from three.js (by the lockfile), the shapes and the modules. If npm cannot
# download three.js, no page is built, and the next build tries again.
set(fetched ${WORK}/node_modules/.perdure-lock)
execute_process(COMMAND ${CMAKE_COMMAND} -E compare_files ${SOURCE}/package-lock.json ${fetched}
  RESULT_VARIABLE changed OUTPUT_QUIET ERROR_QUIET)
if(changed)
  file(REMOVE_RECURSE ${WORK}/node_modules)
  file(COPY ${SOURCE}/package.json ${SOURCE}/package-lock.json DESTINATION ${WORK})
  execute_process(COMMAND ${NPM} ci --ignore-scripts --no-audit --no-fund --loglevel=error
    WORKING_DIRECTORY ${WORK} RESULT_VARIABLE failed OUTPUT_QUIET ERROR_VARIABLE said)
  if(failed)
    message(WARNING "npm ci got nothing, so perdure-gateway has no page; is there a network? ${said}")
    return()
  endif()
  file(COPY_FILE ${SOURCE}/package-lock.json ${fetched})
endif()
file(REMOVE_RECURSE ${PAGE})
if(MESHES)  # unset for another architecture; the page then shows boxes
  execute_process(COMMAND ${MESHES} ${PAGE}/meshes COMMAND_ERROR_IS_FATAL ANY)
endif()
execute_process(COMMAND ${NODE} ${SOURCE}/build.mjs ${PAGE} ${WORK}/node_modules
  COMMAND_ERROR_IS_FATAL ANY)
file(TOUCH ${WORK}/page.stamp)
