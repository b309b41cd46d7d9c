-- expect: 3: error(...) with a value of type function; must be a text
local rd = require "refdyn"
error(function() end)
