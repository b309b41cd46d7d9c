-- expect: 3: error(...) with a value of type nil, a text is needed
local rd = require "refdyn"
error()
