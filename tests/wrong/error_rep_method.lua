-- expect: 3: bad argument #1 to 'rep' (number expected, got table)
local rd = require "refdyn"
local s = ("x"):rep({})
