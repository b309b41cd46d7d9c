-- expect: 3: error(...) with a value of type nil; must be a text
local rd = require "refdyn"
error()
