# Turns files into a C++ source with their bytes:
#   cmake -DOUTPUT=FILE.cc -DNAMESPACE=a::b -DFILES=x.html,y.css -P embed.cmake
# Each file becomes `extern const std::string_view kX_html`-like constants in NAMESPACE: the name
# is "k", the file's base name and its extension, each with a capital letter (report.css: kReportCss).
string(REPLACE "," ";" files "${FILES}")
set(text "// Generated from the files beside report.cc; edit those.\n#include <string_view>\n\n")
string(APPEND text "namespace ${NAMESPACE} {\n")
foreach(file IN LISTS files)
  get_filename_component(name "${file}" NAME)
  string(REGEX MATCHALL "[A-Za-z0-9]+" words "${name}")
  set(identifier "k")
  foreach(word IN LISTS words)
    string(SUBSTRING "${word}" 0 1 first)
    string(SUBSTRING "${word}" 1 -1 rest)
    string(TOUPPER "${first}" first)
    string(APPEND identifier "${first}${rest}")
  endforeach()
  file(READ "${file}" hex HEX)
  string(REGEX REPLACE "([0-9a-f][0-9a-f])" "'\\\\x\\1'," bytes "${hex}")
  # A line break every 16 bytes keeps the source readable for compilers and people.
  set(sixteen "")
  foreach(k RANGE 15)
    string(APPEND sixteen "'[^']*',")
  endforeach()
  string(REGEX REPLACE "(${sixteen})" "\\1\n    " bytes "${bytes}")
  string(APPEND text "namespace {\nconstexpr char ${identifier}Bytes[] = {\n    ${bytes}\n};\n}\n")
  string(APPEND text "extern const std::string_view ${identifier};\n")
  string(APPEND text
    "const std::string_view ${identifier}(${identifier}Bytes, sizeof(${identifier}Bytes));\n")
endforeach()
string(APPEND text "}  // namespace ${NAMESPACE}\n")
file(WRITE "${OUTPUT}" "${text}")
