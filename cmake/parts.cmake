# Leaves out the parts of the project whose packages are missing, and prints one line per part with the names of these packages.
#
#   ldi_leave_out(PART PACKAGE...)      prints that PART is left out because these packages are missing
#   ldi_has(RESULT PART NEED...)        NEED is TARGET=PACKAGE: a target that an earlier find_package() may have defined, and its package
#                                       in Debian. Sets RESULT to true if all targets exist, else leaves PART out.

function(ldi_leave_out part)
    list(JOIN ARGN ", " packages)
    set(severity STATUS)
    if(LDI_REQUIRED AND part MATCHES "${LDI_REQUIRED}")
        set(severity SEND_ERROR)
    endif()
    message(${severity} "Left out: ${part} (missing: ${packages}; packages have their names in Debian)")
endfunction()

function(ldi_has result part)
    set(missing "")
    foreach(need IN LISTS ARGN)
        string(REPLACE "=" ";" need "${need}")
        list(GET need 0 target)
        list(GET need 1 package)
        if(NOT TARGET ${target})
            list(APPEND missing ${package})
        endif()
    endforeach()
    if(missing)
        ldi_leave_out("${part}" ${missing})
        set(${result} FALSE PARENT_SCOPE)
    else()
        set(${result} TRUE PARENT_SCOPE)
    endif()
endfunction()
