-- expect: 3: error(...) with a value of type function, a text is needed
local rd = require "refdyn"
error(function() end)
