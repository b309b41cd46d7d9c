-- expect: 3: error(...) with a value of type table; must be a text
local rd = require "refdyn"
error(setmetatable({}, { __tostring = function() return "a text" end }))
