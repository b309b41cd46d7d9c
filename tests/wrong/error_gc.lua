-- expect: 3: setmetatable: __gc is not allowed in a model
local rd = require "refdyn"
setmetatable({}, { __gc = function() end })
