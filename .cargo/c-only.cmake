# NLopt is built without its C++ parts, yet its project() line asks cmake for a C++ compiler.
# Naming the C compiler, unchecked, keeps a C compiler all that a machine needs.
set(CMAKE_CXX_COMPILER cc)
set(CMAKE_CXX_COMPILER_FORCED TRUE)
