-- expect: 3: malformed pattern (missing ']')
local rd = require "refdyn"
local s = ("x"):find("[")
