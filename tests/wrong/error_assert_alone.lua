-- expect: 3: assertion failed!
local rd = require "refdyn"
assert(nil)
