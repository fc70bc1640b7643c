# Read by cpack before it begins: refuses to make packages of a build that is of no use on other machines.
if(CPACK_LIVETET_UNFIT AND NOT CPACK_LIVETET_ANYWAY)
  message(FATAL_ERROR "${CPACK_LIVETET_UNFIT} (preset \"package\"), or -D CPACK_LIVETET_ANYWAY=ON")
endif()
if(CPACK_LIVETET_UNFIT)
  set(CPACK_DEBIAN_PACKAGE_RELEASE ${CPACK_DEBIAN_PACKAGE_RELEASE}+local)
endif()
